(** The error function of Activations.v: its derivative, and the largest slope of GELU. *)
From Coq Require Import Reals Lra Lia.
From Swarmcert Require Import Exponential Activations.
Open Scope R_scope.

Lemma limit_below (u : nat -> R) l b : Un_cv u l -> (forall n, u n <= b) -> l <= b.
Proof.
  intros C H. destruct (Rle_lt_dec l b) as [|G]; auto. destruct (C (l - b) ltac:(lra)) as [N HN].
  specialize (HN N (le_n N)). specialize (H N). unfold R_dist in HN. apply Rabs_def2 in HN. lra.
Qed.
Lemma constant_limit a : Un_cv (fun _ => a) a.
Proof. intros e He. exists 0%nat. intros n _. unfold R_dist. rewrite Rminus_diag_eq, Rabs_R0; auto. Qed.

(** The integral of exp (- x^2) from 0, and the sums that define it. *)
Definition bell (x : R) : R := exp (- (x * x)).
Definition integral (x : R) : R := x * proj1_sig (erf_series (x * x)).
Definition partial (n : nat) (x : R) : R := sum_f_R0 (fun k => erf_term k * x ^ (2 * k + 1)) n.
Lemma erf_integral x : erf x = 2 / sqrt PI * integral x. Proof. reflexivity. Qed.
Lemma odd_power x k : x ^ (2 * k + 1) = x * (x * x) ^ k.
Proof. rewrite pow_add, pow_1, pow_mult. replace (x ^ 2) with (x * x) by ring. ring. Qed.
Lemma partial_limit x : Un_cv (fun n => partial n x) (integral x).
Proof.
  unfold integral. destruct (erf_series (x * x)) as [s H]. simpl. intros e He.
  set (terms k := erf_term k * (x * x) ^ k) in *.
  destruct (CV_mult (fun _ => x) (sum_f_R0 terms) x s (constant_limit x) H e He) as [N HN].
  exists N. intros n Hn. specialize (HN n Hn). replace (partial n x) with (x * sum_f_R0 terms n); auto.
  unfold partial, terms. rewrite scal_sum. apply sum_eq. intros k _. rewrite odd_power. ring.
Qed.
Lemma partial_derivative n x : derivable_pt_lim (partial n) x (E1 (- (x * x)) n).
Proof.
  assert (forall k, derivable_pt_lim (fun x => erf_term k * x ^ (2 * k + 1)) x (/ INR (fact k) * (- (x * x)) ^ k)) as T.
  { intros k. replace (/ INR (fact k) * (- (x * x)) ^ k)
      with (erf_term k * (INR (2 * k + 1) * x ^ Init.Nat.pred (2 * k + 1))).
    - apply (derivable_pt_lim_scal (fun x => x ^ (2 * k + 1))), derivable_pt_lim_pow.
    - replace (Init.Nat.pred (2 * k + 1)) with (2 * k)%nat by lia.
      rewrite pow_mult. replace (x ^ 2) with (x * x) by ring.
      set (q := x * x). replace (- q) with (-1 * q) by ring. rewrite Rpow_mult_distr. unfold erf_term.
      pose proof (INR_fact_neq_0 k). pose proof (not_0_INR (2 * k + 1) ltac:(lia)). field. auto. }
  induction n as [|n IH]; [apply (T 0%nat)|].
  apply (derivable_pt_lim_plus (partial n) (fun x => erf_term (S n) * x ^ (2 * S n + 1))); [exact IH|apply T].
Qed.

(** What the sums leave out, wherever x^2 <= r. *)
Definition tail (r : R) (n : nat) : R := exp r - E1 r n.
Lemma tail_limit r : Un_cv (tail r) 0.
Proof.
  replace 0 with (exp r - exp r) by ring. apply (CV_minus (fun _ => exp r) (E1 r)); [apply constant_limit|apply E1_cvg].
Qed.
Lemma later_terms y r n m : 0 <= y <= r -> Rabs (E1 (- y) (n + m) - E1 (- y) n) <= E1 r (n + m) - E1 r n.
Proof.
  intros H. induction m as [|m IH]; [rewrite Nat.add_0_r, Rminus_diag_eq, Rabs_R0; lra|].
  rewrite Nat.add_succ_r. unfold E1 in *. rewrite !tech5. set (k := S (n + m)).
  assert (Rabs (/ INR (fact k) * (- y) ^ k) <= / INR (fact k) * r ^ k) as T.
  { pose proof (Rinv_0_lt_compat _ (lt_0_INR _ (lt_O_fact k))).
    rewrite Rabs_mult, Rabs_pos_eq, <- RPow_abs, Rabs_Ropp, (Rabs_pos_eq y) by lra.
    apply Rmult_le_compat_l; [lra|]. now apply pow_incr. }
  eapply Rle_trans; [|apply Rle_trans with (1 := Rplus_le_compat _ _ _ _ IH T); lra].
  eapply Rle_trans; [|apply Rabs_triang]. right. f_equal. ring.
Qed.
Lemma shifted u l n : Un_cv u l -> Un_cv (fun m => u (n + m)%nat) l.
Proof. intros C e He. destruct (C e He) as [N HN]. exists N. intros m Hm. apply HN. lia. Qed.
Lemma tail_bound y r n : 0 <= y <= r -> Rabs (exp (- y) - E1 (- y) n) <= tail r n.
Proof.
  intros H. unfold tail.
  assert (forall s, Un_cv (fun m => s * (E1 (- y) (n + m) - E1 (- y) n) - (E1 r (n + m) - E1 r n))
    (s * (exp (- y) - E1 (- y) n) - (exp r - E1 r n))) as C.
  { intros s. apply (CV_minus (fun m => s * (E1 (- y) (n + m) - E1 (- y) n)) (fun m => E1 r (n + m) - E1 r n)).
    - apply (CV_mult (fun _ => s) (fun m => E1 (- y) (n + m) - E1 (- y) n)); [apply constant_limit|].
      apply (CV_minus (fun m => E1 (- y) (n + m)) (fun _ => E1 (- y) n)); [|apply constant_limit].
      apply shifted, E1_cvg.
    - apply (CV_minus (fun m => E1 r (n + m)) (fun _ => E1 r n)); [|apply constant_limit]. apply shifted, E1_cvg. }
  assert (forall s, s = 1 \/ s = - (1) -> s * (exp (- y) - E1 (- y) n) - (exp r - E1 r n) <= 0) as B.
  { intros s Hs. apply (limit_below _ _ _ (C s)). intros m. pose proof (later_terms y r n m H) as L.
    pose proof (Rle_abs (E1 (- y) (n + m) - E1 (- y) n)). pose proof (Rle_abs (- (E1 (- y) (n + m) - E1 (- y) n))) as N.
    rewrite Rabs_Ropp in N. destruct Hs; subst; lra. }
  pose proof (B 1 (or_introl eq_refl)). pose proof (B (- (1)) (or_intror eq_refl)). apply Rabs_le. lra.
Qed.

Lemma square_between x y c : x <= c <= y -> c * c <= x * x + y * y.
Proof. intros [H G]. destruct (Rle_lt_dec 0 c); nra. Qed.
Lemma integral_below x y b : x <= y -> (forall c, x <= c <= y -> bell c <= b) ->
  integral y - integral x <= b * (y - x).
Proof.
  intros L H. set (r := x * x + y * y).
  assert (Un_cv (fun n => partial n y - partial n x - (b + tail r n) * (y - x))
    (integral y - integral x - (b + 0) * (y - x))) as C.
  { apply (CV_minus (fun n => partial n y - partial n x) (fun n => (b + tail r n) * (y - x))).
    - apply (CV_minus (fun n => partial n y) (fun n => partial n x)); apply partial_limit.
    - apply (CV_mult (fun n => b + tail r n) (fun _ => y - x)); [|apply constant_limit].
      apply (CV_plus (fun _ => b) (tail r)); [apply constant_limit|apply tail_limit]. }
  apply limit_below with (b := 0) in C; [lra|]. intros n.
  pose proof (at_most_the_derivative (partial n) (fun c => E1 (- (c * c)) n) (b + tail r n) x y L) as D.
  apply Rle_minus, D. intros c Hc. split; [apply partial_derivative|]. specialize (H c Hc). unfold bell in H.
  pose proof (tail_bound (c * c) r n) as T. pose proof (square_between x y c Hc). pose proof (Rle_0_sqr c).
  pose proof (Rle_abs (- (exp (- (c * c)) - E1 (- (c * c)) n))) as N. rewrite Rabs_Ropp in N.
  unfold Rsqr, r in *. specialize (T ltac:(lra)). lra.
Qed.
Lemma integral_odd x : integral (- x) = - integral x.
Proof. unfold integral. rewrite Rmult_opp_opp. ring. Qed.
Lemma integral_above x y a : x <= y -> (forall c, x <= c <= y -> a <= bell c) ->
  a * (y - x) <= integral y - integral x.
Proof.
  intros L H. set (r := x * x + y * y).
  assert (Un_cv (fun n => (a - tail r n) * (y - x) - (partial n y - partial n x))
    ((a - 0) * (y - x) - (integral y - integral x))) as C.
  { apply (CV_minus (fun n => (a - tail r n) * (y - x)) (fun n => partial n y - partial n x)).
    - apply (CV_mult (fun n => a - tail r n) (fun _ => y - x)); [|apply constant_limit].
      apply (CV_minus (fun _ => a) (tail r)); [apply constant_limit|apply tail_limit].
    - apply (CV_minus (fun n => partial n y) (fun n => partial n x)); apply partial_limit. }
  apply limit_below with (b := 0) in C; [lra|]. intros n.
  pose proof (at_least_the_derivative (partial n) (fun c => E1 (- (c * c)) n) (a - tail r n) x y L) as D.
  apply Rle_minus, D. intros c Hc. split; [apply partial_derivative|]. specialize (H c Hc). unfold bell in H.
  pose proof (tail_bound (c * c) r n) as T. pose proof (square_between x y c Hc). pose proof (Rle_0_sqr c).
  pose proof (Rle_abs (exp (- (c * c)) - E1 (- (c * c)) n)).
  unfold Rsqr, r in *. specialize (T ltac:(lra)). lra.
Qed.
Lemma bell_derivative x : derivable_pt_lim bell x (bell x * - (1 * x + x * 1)).
Proof.
  apply (derivable_pt_lim_comp (fun x => - (x * x)) exp); [|apply derivable_pt_lim_exp].
  apply (derivable_pt_lim_opp (fun x => x * x)), (derivable_pt_lim_mult id id); apply derivable_pt_lim_id.
Qed.
Lemma integral_derivative x : derivable_pt_lim integral x (bell x).
Proof.
  intros e He.
  destruct (derivable_continuous_pt bell x (exist _ _ (bell_derivative x)) (e / 2) ltac:(lra)) as (d & Hd & H).
  assert (forall c, Rabs (c - x) < d -> bell x - e / 2 <= bell c <= bell x + e / 2) as Near.
  { intros c Hc. destruct (Req_dec x c) as [->|N]; [lra|].
    specialize (H c). simpl in H. unfold R_dist, D_x, no_cond in H. specialize (H ltac:(auto)).
    apply Rabs_def2 in H. lra. }
  exists (mkposreal d Hd). intros h H0 Hh. simpl in Hh. set (q := (integral (x + h) - integral x) / h).
  assert (q * h = integral (x + h) - integral x) as Q by (unfold q; field; auto).
  assert (bell x - e / 2 <= q <= bell x + e / 2); [|apply Rabs_def1; lra].
  destruct (Rle_lt_dec 0 h).
  - rewrite Rabs_pos_eq in Hh by auto.
    pose proof (integral_below x (x + h) (bell x + e / 2) ltac:(lra)) as U.
    pose proof (integral_above x (x + h) (bell x - e / 2) ltac:(lra)) as D.
    assert (forall c, x <= c <= x + h -> bell x - e / 2 <= bell c <= bell x + e / 2) as B
      by (intros; apply Near; rewrite Rabs_pos_eq; lra).
    specialize (U (fun c Hc => proj2 (B c Hc))). specialize (D (fun c Hc => proj1 (B c Hc))).
    split; apply (Rmult_le_reg_r h); lra.
  - rewrite Rabs_left in Hh by auto.
    pose proof (integral_below (x + h) x (bell x + e / 2) ltac:(lra)) as U.
    pose proof (integral_above (x + h) x (bell x - e / 2) ltac:(lra)) as D.
    assert (forall c, x + h <= c <= x -> bell x - e / 2 <= bell c <= bell x + e / 2) as B
      by (intros; apply Near; rewrite Rabs_left1; lra).
    specialize (U (fun c Hc => proj2 (B c Hc))). specialize (D (fun c Hc => proj1 (B c Hc))).
    split; apply (Rmult_le_reg_r (- h)); lra.
Qed.
Lemma integral_nonneg x : 0 <= x -> 0 <= integral x.
Proof.
  intros H. pose proof (integral_above 0 x 0 H (fun c _ => Rlt_le _ _ (exp_pos _))) as I.
  assert (integral 0 = 0) as Z by (unfold integral; ring). lra.
Qed.

(** Its value at 1, by the first seven terms. *)
Ltac numbers := rewrite ?INR_IZR_INZ;
  repeat match goal with |- context [Z.of_nat ?n] =>
    let v := eval vm_compute in (Z.of_nat n) in change (Z.of_nat n) with v end.
Lemma integral_at_1 : integral 1 <= 74684 / 100000.
Proof.
  set (u k := / (INR (fact k) * INR (2 * k + 1))).
  assert (forall k, 0 < INR (fact k) * INR (2 * k + 1)) as P by apply erf_divisor.
  assert (forall k, 1 <= INR (fact k)) as F by (intros k; apply (le_INR 1), lt_O_fact).
  assert (Un_decreasing u) as Falls.
  { intros k. apply Rinv_le_contravar; [apply P|]. apply Rmult_le_compat; try apply pos_INR; apply le_INR; [|lia].
    apply fact_le. lia. }
  assert (Un_cv u 0) as Vanishes.
  { intros e He. destruct (archimed_cor1 e He) as (N & HN & HP). exists N. intros k Hk. unfold R_dist.
    rewrite Rminus_0_r, Rabs_pos_eq by (apply Rlt_le, Rinv_0_lt_compat, P). eapply Rle_lt_trans; [|exact HN].
    assert (0 < INR N) by (apply lt_0_INR; lia). apply Rinv_le_contravar; auto.
    assert (INR N <= INR (2 * k + 1)) by (apply le_INR; lia). specialize (F k). nra. }
  assert (Un_cv (fun n => sum_f_R0 (tg_alt u) n) (integral 1)) as S.
  { intros e He. destruct (partial_limit 1 e He) as [N HN]. exists N. intros n Hn. specialize (HN n Hn).
    replace (sum_f_R0 (tg_alt u) n) with (partial n 1); auto. apply sum_eq. intros k _. rewrite pow1.
    unfold tg_alt, u, erf_term, Rdiv. ring. }
  destruct (alternated_series_ineq u (integral 1) 3 Falls Vanishes S) as [_ B]. eapply Rle_trans; [exact B|].
  unfold tg_alt, u. simpl sum_f_R0. numbers. lra.
Qed.
(** Since cos 1.57 is positive. *)
Lemma pi_large : 314 / 100 <= PI.
Proof.
  destruct (Rle_lt_dec (314 / 100) PI) as [|G]; auto. exfalso.
  destruct (pre_cos_bound (785 / 1000) 1 ltac:(lra) ltac:(lra)) as [B _].
  unfold cos_approx, cos_term in B. change (2 * 1 + 1)%nat with 3%nat in B. cbn [sum_f_R0] in B.
  revert B. numbers. simpl pow. intros B.
  pose proof (cos_2a_cos (785 / 1000)) as C. pose proof (cos_le_0 (2 * (785 / 1000))) as D. destruct pi2_int as [H _].
  unfold PI in *.
  specialize (D ltac:(lra) ltac:(lra)). assert (7073 / 10000 <= cos (785 / 1000)) by lra. nra.
Qed.
Lemma inverse_e : bell 1 <= 3679 / 10000.
Proof.
  assert (10157470 / 10000000 <= exp (/ 64)) as H by (pose proof (exp_square (/ 64) ltac:(lra)); lra).
  apply exp_double with (b := 10317419 / 10000000) in H; [|lra|lra].
  apply exp_double with (b := 10644913 / 10000000) in H; [|lra|lra].
  apply exp_double with (b := 11331417 / 10000000) in H; [|lra|lra].
  apply exp_double with (b := 12840101 / 10000000) in H; [|lra|lra].
  apply exp_double with (b := 16486819 / 10000000) in H; [|lra|lra].
  apply exp_double with (b := 27181520 / 10000000) in H; [|lra|lra].
  replace (2 * _) with 1 in H by field. pose proof (exp_opp 1). unfold bell. rewrite Rmult_1_l.
  apply (Rmult_le_reg_l (exp 1)); lra.
Qed.

(** GELU at u sqrt 2, divided by sqrt 2. *)
Definition gelu_scaled (u : R) : R := / 2 * (u * (1 + 2 / sqrt PI * integral u)).
Lemma sqrt_2_positive : 0 < sqrt 2. Proof. apply sqrt_lt_R0. lra. Qed.
Lemma gelu_at x : act Gelu x = sqrt 2 * gelu_scaled (x / sqrt 2).
Proof.
  unfold act, gelu_scaled. rewrite erf_integral. pose proof sqrt_2_positive. field. pose proof pi_large.
  split; [|lra]. apply Rgt_not_eq, sqrt_lt_R0. lra.
Qed.
Definition gelu_slope (u : R) : R := / 2 * (1 + 2 / sqrt PI * integral u) + / sqrt PI * (u * bell u).
Lemma gelu_derivative u : derivable_pt_lim gelu_scaled u (gelu_slope u).
Proof.
  replace (gelu_slope u) with (/ 2 * (1 * (1 + 2 / sqrt PI * integral u) + u * (0 + 2 / sqrt PI * bell u)))
    by (unfold gelu_slope, Rdiv; field; apply Rgt_not_eq, sqrt_lt_R0; pose proof pi_large; lra).
  apply (derivable_pt_lim_scal (fun u => u * (1 + 2 / sqrt PI * integral u))).
  apply (derivable_pt_lim_mult id (fun u => 1 + 2 / sqrt PI * integral u)); [apply derivable_pt_lim_id|].
  apply (derivable_pt_lim_plus (fun _ => 1) (fun u => 2 / sqrt PI * integral u)); [apply derivable_pt_lim_const|].
  apply (derivable_pt_lim_scal integral), integral_derivative.
Qed.
Definition gelu_curvature (u : R) : R := / sqrt PI * (2 * (bell u * (1 - u * u))).
Lemma gelu_slope_derivative u : derivable_pt_lim gelu_slope u (gelu_curvature u).
Proof.
  replace (gelu_curvature u) with
    (/ 2 * (0 + 2 / sqrt PI * bell u) + / sqrt PI * (1 * bell u + u * (bell u * - (1 * u + u * 1))))
    by (unfold gelu_curvature, Rdiv; field; apply Rgt_not_eq, sqrt_lt_R0; pose proof pi_large; lra).
  apply (derivable_pt_lim_plus (fun u => / 2 * (1 + 2 / sqrt PI * integral u)) (fun u => / sqrt PI * (u * bell u))).
  - apply (derivable_pt_lim_scal (fun u => 1 + 2 / sqrt PI * integral u)).
    apply (derivable_pt_lim_plus (fun _ => 1) (fun u => 2 / sqrt PI * integral u)); [apply derivable_pt_lim_const|].
    apply (derivable_pt_lim_scal integral), integral_derivative.
  - apply (derivable_pt_lim_scal (fun u => u * bell u)), (derivable_pt_lim_mult id bell);
      [apply derivable_pt_lim_id|apply bell_derivative].
Qed.
Lemma root_pi_large : 1772 / 1000 <= sqrt PI.
Proof.
  pose proof pi_large. rewrite <- (sqrt_square (1772 / 1000)) by lra. apply sqrt_le_1_alt. lra.
Qed.
Lemma gelu_slope_at_1 : gelu_slope 1 <= 4625 / 4096.
Proof.
  pose proof root_pi_large as P. pose proof integral_at_1. pose proof inverse_e. set (k := / sqrt PI).
  assert (0 < k) by (apply Rinv_0_lt_compat; lra).
  assert (k <= 1000 / 1772) by (replace (1000 / 1772) with (/ (1772 / 1000)) by field; apply Rinv_le_contravar; lra).
  replace (gelu_slope 1) with (/ 2 + k * (integral 1 + bell 1)) by (unfold gelu_slope, k, Rdiv; field; lra). nra.
Qed.
(** Its derivative rises up to u = 1 and falls from there. *)
Lemma gelu_slope_right u : 0 <= u -> / 2 <= gelu_slope u <= 4625 / 4096.
Proof.
  intros H. pose proof root_pi_large. assert (0 < / sqrt PI) as K by (apply Rinv_0_lt_compat; lra).
  pose proof (exp_pos (- (u * u))) as E. fold (bell u) in E. split.
  - pose proof (integral_nonneg u H). unfold gelu_slope, Rdiv. pose proof (Rmult_le_pos _ _ H (Rlt_le _ _ E)).
    pose proof (Rmult_le_pos _ _ (Rlt_le _ _ K) H2). pose proof (Rmult_le_pos _ _ (Rlt_le _ _ K) H1). lra.
  - apply Rle_trans with (2 := gelu_slope_at_1). destruct (Rle_lt_dec u 1) as [L|L].
    + enough (0 * (1 - u) <= gelu_slope 1 - gelu_slope u) by lra.
      apply (at_least_the_derivative _ gelu_curvature _ _ _ L).
      intros c Hc. split; [apply gelu_slope_derivative|]. pose proof (exp_pos (- (c * c))) as B. fold (bell c) in B.
      assert (0 <= 1 - c * c) by nra. pose proof (Rmult_le_pos _ _ (Rlt_le _ _ B) H1). apply Rmult_le_pos; lra.
    + enough (gelu_slope u - gelu_slope 1 <= 0 * (u - 1)) by lra.
      apply (at_most_the_derivative _ gelu_curvature); [lra|].
      intros c Hc. split; [apply gelu_slope_derivative|]. pose proof (exp_pos (- (c * c))) as B. fold (bell c) in B.
      assert (0 <= c * c - 1) by nra. pose proof (Rmult_le_pos _ _ (Rlt_le _ _ B) H1).
      enough (0 <= / sqrt PI * (2 * (bell c * (c * c - 1)))) by (unfold gelu_curvature; lra).
      apply Rmult_le_pos; lra.
Qed.
Lemma gelu_slope_left u : gelu_slope (- u) = 1 - gelu_slope u.
Proof.
  unfold gelu_slope, bell. rewrite integral_odd, Rmult_opp_opp. field. apply Rgt_not_eq. pose proof root_pi_large. lra.
Qed.
Lemma gelu_slope_between u : - (529 / 4096) <= gelu_slope u <= 4625 / 4096.
Proof.
  destruct (Rle_lt_dec 0 u) as [H|H]; [pose proof (gelu_slope_right u H); lra|].
  replace u with (- - u) by ring. rewrite gelu_slope_left. pose proof (gelu_slope_right (- u) ltac:(lra)). lra.
Qed.
Lemma gelu_slopes : slopes (act Gelu) (- (529 / 4096)) (4625 / 4096).
Proof.
  intros x y L. rewrite !gelu_at. pose proof sqrt_2_positive as P. set (k := sqrt 2) in *.
  assert (x / k <= y / k) as Q by (apply Rmult_le_compat_r; auto; apply Rlt_le, Rinv_0_lt_compat, P).
  pose proof gelu_slope_between as B.
  pose proof (at_least_the_derivative gelu_scaled _ _ _ _ Q (fun c _ => conj (gelu_derivative c) (proj1 (B c)))) as D.
  pose proof (at_most_the_derivative gelu_scaled _ _ _ _ Q (fun c _ => conj (gelu_derivative c) (proj2 (B c)))) as U.
  apply (Rmult_le_compat_l k) in D, U; try lra.
  replace (k * (- (529 / 4096) * (y / k - x / k))) with (- (529 / 4096) * (y - x)) in D by (field; lra).
  replace (k * (4625 / 4096 * (y / k - x / k))) with (4625 / 4096 * (y - x)) in U by (field; lra). lra.
Qed.
