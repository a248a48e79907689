(** Set functions that are 0 in some compositions: while the terms are the same ones, no more changes than without
    silence; ranges hold the 0; and a term that comes or goes. *)
From Coq Require Import List ZArith Reals Lra Lia Bool Permutation.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Parts Claims Slopes Witness Laws Ranges.
Import ListNotations.
Open Scope R_scope.

(** Slopes and laws speak of terms that move: they come to no other sum, silent or not. *)
Lemma silent_change ps silent rho those s t :
  norm (minus (unless_silent ps silent rho those s) (unless_silent ps silent rho those t)) <=
    norm (minus (value (part_at ps rho) s) (value (part_at ps rho) t)).
Proof.
  unfold unless_silent. destruct (is_silent silent those); [|lra]. unfold norm at 1.
  rewrite square_minus_same, sqrt_0. apply sqrt_pos.
Qed.
Theorem silent_slope ps silent phi rho moves scale u : holds ps (Slope_at_most (Set_of phi rho) moves scale u) ->
  forall those rest x y, agree moves x y -> length x = inputs_of (part_at ps phi) ->
  let f z := unless_silent ps silent rho those (plusR (value (part_at ps phi) z) rest) in
  norm (minus (f x) (f y)) <= real u * distance scale x y.
Proof. intros H those rest x y A L. eapply Rle_trans; [apply silent_change|]. now apply (H rest x y). Qed.
Theorem silent_slope_in_box ps silent phi rho moves scale b u :
  holds ps (Slope_in_box (Set_of phi rho) moves scale b u) ->
  forall those rest x y, agree moves x y -> length x = inputs_of (part_at ps phi) -> within b x -> within b y ->
  let f z := unless_silent ps silent rho those (plusR (value (part_at ps phi) z) rest) in
  norm (minus (f x) (f y)) <= real u * distance scale x y.
Proof. intros H those rest x y A L X Y. eapply Rle_trans; [apply silent_change|]. now apply (H rest x y). Qed.
Theorem silent_slope_among ps silent p rho moves scale b others u :
  holds ps (Slope_among p rho moves scale b others u) ->
  forall those inputs x y, Forall2 may_stand others inputs -> agree moves x y ->
  length x = inputs_of (part_at ps p) -> within b x -> within b y ->
  let term t := map (value (part_at ps (phi (fst t)))) (snd t) in
  let rest := vector_sum (flat_map term (combine others inputs)) in
  let f z := unless_silent ps silent rho those (plusR (value (part_at ps p) z) rest) in
  norm (minus (f x) (f y)) <= real u * distance scale x y.
Proof. intros H those inputs x y M A L X Y. eapply Rle_trans; [apply silent_change|]. now apply (H inputs x y). Qed.
(** What `Law`, `Law_in_box` and `Law_among` conclude. *)
Theorem silent_law ps silent those stacked rho u s t movers :
  bounded_change stacked u (minus (value (part_at ps rho) s) (value (part_at ps rho) t)) movers ->
  bounded_change stacked u
    (minus (unless_silent ps silent rho those s) (unless_silent ps silent rho those t)) movers.
Proof.
  pose proof (silent_change ps silent rho those s t) as C. destruct stacked; simpl; [lra|].
  intros H r R F. specialize (H r R F). lra.
Qed.

(** Compositions *)
Lemma count_occ_of p l : count_of p l = count_occ Nat.eq_dec l p.
Proof.
  unfold count_of. induction l as [|q l IH]; simpl; auto.
  destruct (Nat.eqb_spec p q), (Nat.eq_dec q p); simpl; congruence.
Qed.
Lemma same_terms_permutation a b : same_terms a b = true <-> Permutation a b.
Proof.
  rewrite (Permutation_count_occ Nat.eq_dec). unfold same_terms. rewrite forallb_forall. split; intros H p.
  - rewrite <- !count_occ_of. destruct (in_dec Nat.eq_dec p (a ++ b)) as [I|I]; [now apply Nat.eqb_eq, H|].
    rewrite !count_occ_of. rewrite in_app_iff in I.
    assert (~ In p a /\ ~ In p b) as [Ia Ib] by tauto. apply (count_occ_not_In Nat.eq_dec) in Ia, Ib. congruence.
  - intros _. apply Nat.eqb_eq. now rewrite !count_occ_of.
Qed.
Lemma silent_permutation silent a : is_silent silent a = true <-> exists c, In c silent /\ Permutation a c.
Proof.
  unfold is_silent. rewrite existsb_exists. split; intros (c & I & H); exists c; split; auto;
    now apply same_terms_permutation.
Qed.
Lemma vector_sum_permutation us vs : Permutation us vs -> vector_sum us = vector_sum vs.
Proof.
  intros H. induction H; simpl; auto; [congruence| |congruence]. now rewrite <- !plus_assoc, (plus_comm y).
Qed.

(** Ranges *)
Lemma size_length {A} (l : list A) : size l = Z.of_nat (length l).
Proof.
  induction l as [|a l IH]; [reflexivity|].
  change (size (a :: l)) with (1 + size l)%Z. change (length (a :: l)) with (S (length l)). lia.
Qed.
Lemma number_between terms inputs p : Forall2 may_stand terms inputs ->
  (number_of fewest p terms <= Z.of_nat (count_of p (networks_in (combine terms inputs))) <=
     number_of Meaning.most p terms)%Z.
Proof.
  intros H. induction H as [|t xs terms inputs [K _] H IH]; [unfold count_of; simpl; lia|].
  unfold networks_in in *. simpl. unfold count_of in *. rewrite filter_app, app_length.
  assert (length (filter (Nat.eqb p) (map (fun _ => phi t) xs)) = if (phi t =? p)%nat then length xs else O) as E.
  { clear. rewrite Nat.eqb_sym. induction xs as [|x xs IH]; simpl; [now destruct (_ =? _)%nat|].
    destruct (p =? phi t)%nat; simpl; auto. }
  rewrite E. destruct (phi t =? p)%nat; lia.
Qed.
Lemma may_be_silent_sound silent terms inputs : Forall2 may_stand terms inputs ->
  is_silent silent (networks_in (combine terms inputs)) = true -> may_be_silent silent terms = true.
Proof.
  intros H S. apply silent_permutation in S. destruct S as (c & I & S). apply existsb_exists. exists c. split; auto.
  apply forallb_forall. intros p _. pose proof (number_between _ _ p H) as T.
  assert (count_of p (networks_in (combine terms inputs)) = count_of p c) as E.
  { rewrite !count_occ_of. now apply Permutation_count_occ. }
  rewrite E in T. unfold count_of in T. unfold times_in. rewrite size_length.
  apply andb_true_intro. split; apply Z.leb_le; lia.
Qed.
Lemma among_choices n terms inputs : Forall (fun t => (Meaning.most t <= Z.of_nat n)%Z) terms ->
  Forall2 may_stand terms inputs -> In (networks_in (combine terms inputs)) (all_choices n terms).
Proof.
  intros N H. induction H as [|t xs terms inputs [K _] H IH]; [now left|]. inversion N; subst.
  unfold networks_in in *. simpl combine. simpl flat_map. simpl all_choices.
  replace (map (fun _ => phi t) xs) with (repeat (phi t) (length xs)) by (clear; induction xs; simpl; congruence).
  apply in_flat_map. exists (repeat (phi t) (length xs)). split; [|now apply in_map, IH].
  unfold choices_of. apply filter_In. split; [apply in_map, in_seq; lia|].
  rewrite size_length, repeat_length. apply andb_true_intro. split; apply Z.leb_le; lia.
Qed.
Lemma always_silent_sound silent terms inputs : Forall2 may_stand terms inputs -> always_silent silent terms = true ->
  is_silent silent (networks_in (combine terms inputs)) = true.
Proof.
  unfold always_silent. set (n := fold_right _ _ _). destruct (forallb _ terms) eqn:E; [|discriminate].
  rewrite forallb_forall. intros H A. apply A, among_choices; auto. rewrite forallb_forall in E.
  apply Forall_forall. intros t I. specialize (E t I). rewrite size_length, repeat_length in E.
  now apply Z.leb_le.
Qed.
Lemma zeros_within n : within (repeat (zero, zero) n) (zeros n).
Proof. unfold zeros. induction n; simpl; auto. rewrite real_zero. split; auto. lra. Qed.
Lemma sum_within_sound ps accepted silent terms rho v sums : Forall (holds ps) accepted ->
  check_sum_within ps accepted silent terms rho v sums = true -> holds ps (Sum_within silent terms rho v).
Proof.
  intros HA. unfold check_sum_within. destruct (sum_ends _ _ _) as [s|] eqn:Es; [|discriminate].
  destruct (find_within _ _ _) as [w|] eqn:Ew; [|discriminate]. intros H inputs M. cbv zeta.
  set (those := networks_in _). do 2 both H.
  unfold unless_silent. destruct (is_silent silent those) eqn:E; unfold those in E.
  - rewrite (may_be_silent_sound _ _ _ M E) in H0. eapply contains_within; [exact H0|]. apply zeros_within.
  - destruct (contains v w) eqn:C; [|simpl in H1; rewrite (always_silent_sound _ _ _ M H1) in E; discriminate].
    eapply contains_within; eauto. apply (find_within_sound _ _ _ _ _ HA Ew). eapply contains_within; eauto.
    eapply sum_ends_sound; eauto.
Qed.

(** A term that comes or goes *)
Lemma norm_minus_zeros n v : norm (minus (zeros n) v) = norm v.
Proof.
  unfold norm, square. f_equal. unfold minus, zeros. revert n. induction v as [|a v IH]; intros [|n]; simpl; auto.
  - clear. induction n; simpl; lra.
  - specialize (IH O). simpl in IH. rewrite IH. ring.
  - rewrite IH. ring.
Qed.
Lemma norm_minus_zeros_r n v : norm (minus v (zeros n)) = norm v.
Proof.
  unfold norm, square. f_equal. unfold minus, zeros. revert n. induction v as [|a v IH]; intros [|n]; simpl; auto.
  - ring_simplify. clear. induction n; simpl; lra.
  - rewrite IH. ring.
Qed.
Lemma find_jump_sound ps accepted p b rho u : Forall (holds ps) accepted -> find_jump accepted p b rho = Some u ->
  holds ps (Jump_at_most p b rho u).
Proof.
  intros H. induction H as [|c rest Hc H IH]; [discriminate|]. destruct c; simpl find_jump; auto.
  destruct (Nat.eqb_spec p phi), (Nat.eqb_spec rho rho0); simpl; auto. destruct (same_box b b0) eqn:E; auto.
  apply same_box_eq in E. intros G. inversion G. subst. exact Hc.
Qed.
Lemma without_permutation p c : (0 < count_of p c)%nat -> Permutation c (p :: without p c).
Proof.
  induction c as [|q c IH]; unfold count_of in *; simpl; [lia|]. destruct (Nat.eqb_spec p q); [subst; auto|].
  intros H. rewrite perm_swap. auto.
Qed.
Lemma beside_more silent p those : is_silent silent those = true -> is_silent silent (p :: those) = false ->
  exists c, In c (beside silent p) /\ Permutation (p :: those) c.
Proof.
  intros S N. apply silent_permutation in S. destruct S as (c & I & P). exists (p :: c).
  split; [|now constructor]. apply filter_In. split; [apply in_flat_map; exists c; simpl; auto|].
  apply negb_true_iff. destruct (is_silent silent (p :: c)) eqn:E; auto. apply silent_permutation in E.
  destruct E as (d & J & Q). rewrite <- N. symmetry. apply silent_permutation. exists d. split; auto.
  rewrite <- Q. now constructor.
Qed.
Lemma beside_less silent p those : is_silent silent (p :: those) = true -> is_silent silent those = false ->
  exists c, In c (beside silent p) /\ Permutation those c.
Proof.
  intros S N. apply silent_permutation in S. destruct S as (c & I & P).
  assert (0 < count_of p c)%nat as C.
  { rewrite count_occ_of, <- (proj1 (Permutation_count_occ Nat.eq_dec _ _) P p). simpl.
    destruct (Nat.eq_dec p p); [lia|congruence]. }
  pose proof (without_permutation _ _ C) as W.
  assert (Permutation those (without p c)) as T by (apply (Permutation_cons_inv (a := p)); now rewrite P).
  exists (without p c). split; auto. apply filter_In. split.
  - apply in_flat_map. exists c. split; auto. right. destruct (Nat.eqb_spec (count_of p c) 0); [lia|now left].
  - apply negb_true_iff. destruct (is_silent silent (without p c)) eqn:E; auto. apply silent_permutation in E.
    destruct E as (d & J & Q). rewrite <- N. symmetry. apply silent_permutation. exists d. split; auto.
    now rewrite T.
Qed.
Lemma all_among ps accepted boxes rho u cs sums c : check_all_among ps accepted boxes rho u cs sums = true -> In c cs ->
  exists s, check_value_among ps accepted boxes rho u c s = true.
Proof.
  revert sums. induction cs as [|d cs IH]; intros [|s sums]; simpl; try discriminate; try tauto.
  intros H [E|I]; both H; [subst; eauto|eauto].
Qed.
Lemma terms_of_stand ps boxes rho ts terms : terms_of boxes (map fst terms) = Some ts ->
  Forall (in_its_box boxes) terms -> let inputs := map (fun t => [snd t]) terms in
  Forall2 may_stand ts inputs /\ sum_of_terms ps rho (combine ts inputs) = sum_of_singles ps rho terms.
Proof.
  intros E H. enough (forall us, terms_of boxes (map fst terms) = Some us ->
    let inputs := map (fun t => [snd t]) terms in Forall2 may_stand us inputs /\
    flat_map (fun g => map (value (part_at ps (phi (fst g)))) (snd g)) (combine us inputs) =
      map (fun t => value (part_at ps (fst t)) (snd t)) terms) as G.
  { destruct (G _ E) as [G1 G2]. split; auto. unfold sum_of_terms, sum_of_singles. now rewrite G2. }
  clear E ts. induction H as [|[p x] terms Ht H IH]; simpl; intros us E; [inversion E; simpl; auto|].
  unfold in_its_box in Ht. simpl in Ht. destruct (box_of boxes p) as [b|]; [|discriminate].
  destruct (terms_of boxes (map fst terms)) as [ts|]; [|discriminate]. inversion E. subst.
  destruct (IH _ eq_refl) as [G1 G2]. split; [constructor; auto; split; [simpl; lia|simpl; auto]|].
  simpl. now rewrite G2.
Qed.
Lemma value_among ps accepted boxes rho u c s terms : Forall (holds ps) accepted -> 0 <= real u ->
  check_value_among ps accepted boxes rho u c s = true -> Permutation (map fst terms) c ->
  Forall (in_its_box boxes) terms -> norm (value (part_at ps rho) (sum_of_singles ps rho terms)) <= real u.
Proof.
  intros HA U H P B. apply Permutation_sym in P. destruct (Permutation_map_inv _ _ P) as (sorted & E & Q). subst c.
  assert (sum_of_singles ps rho terms = sum_of_singles ps rho sorted) as S.
  { apply vector_sum_permutation. constructor. now apply Permutation_map. }
  assert (Forall (in_its_box boxes) sorted) as B' by (eapply Permutation_Forall; eauto).
  unfold check_value_among in H. destruct (terms_of _ _) as [ts|] eqn:Et; [|discriminate].
  destruct (sum_ends _ _ _) as [e|] eqn:Ee; [|discriminate].
  destruct (find_within _ _ _) as [w|] eqn:Ew; [|discriminate]. both H.
  destruct (terms_of_stand ps _ rho _ _ Et B') as [M G].
  assert (within w (value (part_at ps rho) (sum_of_singles ps rho terms))) as W.
  { rewrite S, <- G. apply (find_within_sound _ _ _ _ _ HA Ew). eapply contains_within; eauto.
    eapply sum_ends_sound; eauto. }
  apply at_most_real in H0. rewrite real_mul, real_square in H0. pose proof (square_below _ _ W).
  apply sqrt_below; auto. lra.
Qed.

Lemma length_vector_sum n us : Forall (fun u => length u = n) us -> length (vector_sum (zeros n :: us)) = n.
Proof.
  assert (length (zeros n) = n) as Z by apply repeat_length. intros H. induction H as [|u us Hu H IH]; simpl in *.
  - now rewrite plus_nil_r.
  - rewrite plus_comm, plus_assoc, (plus_comm _ (zeros n)), length_plus; congruence.
Qed.
Lemma box_of_in boxes p b : box_of boxes p = Some b -> In (p, b) boxes.
Proof.
  induction boxes as [|[q c] boxes IH]; simpl; [discriminate|]. destruct (Nat.eqb_spec p q); auto.
  intros E. left. congruence.
Qed.
Lemma length_sum_of_singles ps boxes rho terms :
  forallb (fun b => fits_part (part_at ps (fst b)) && (outputs_of (part_at ps (fst b)) =? inputs_of (part_at ps
    rho))%nat) boxes = true -> Forall (in_its_box boxes) terms ->
  length (sum_of_singles ps rho terms) = inputs_of (part_at ps rho).
Proof.
  intros F H. apply length_vector_sum, Forall_map. eapply Forall_impl; [|exact H]. intros [p x] B.
  unfold in_its_box in B. simpl in *. destruct (box_of boxes p) as [b|] eqn:E; [|tauto].
  rewrite forallb_forall in F. specialize (F _ (box_of_in _ _ _ E)). simpl in F. both F. apply Nat.eqb_eq in H0.
  now rewrite length_value.
Qed.
Lemma step_at_most_sound ps accepted silent boxes p rho u sums : Forall (holds ps) accepted ->
  check_step ps accepted silent boxes p rho u sums = true -> holds ps (Step_at_most silent boxes p rho u).
Proof.
  intros HA. unfold check_step. intros H x others B. do 3 both H. apply real_nonnegative in H.
  rename H1 into Hj, H0 into Hs, H2 into Hf. inversion B as [|? ? Bx Bo]; subst.
  destruct (box_of boxes p) as [b|] eqn:Eb; [|discriminate].
  destruct (find_jump accepted p b rho) as [w|] eqn:Ew; [|discriminate]. apply at_most_real in Hj.
  unfold set_value, unless_silent. simpl map.
  destruct (is_silent silent (p :: map fst others)) eqn:E1; destruct (is_silent silent (map fst others)) eqn:E2.
  - unfold norm. rewrite square_minus_same, sqrt_0. exact H.
  - destruct (beside_less _ _ _ E1 E2) as (c & I & P). destruct (all_among _ _ _ _ _ _ _ _ Hs I) as [s V].
    rewrite norm_minus_zeros. eapply value_among; eauto.
  - destruct (beside_more _ _ _ E2 E1) as (c & I & P). destruct (all_among _ _ _ _ _ _ _ _ Hs I) as [s V].
    rewrite norm_minus_zeros_r. eapply value_among; eauto.
  - eapply Rle_trans; [|exact Hj]. unfold in_its_box in Bx. simpl in Bx. rewrite Eb in Bx.
    pose proof (find_jump_sound _ _ _ _ _ _ HA Ew x (sum_of_singles ps rho others) Bx
      (length_sum_of_singles _ _ _ _ Hf Bo)) as J.
    replace (sum_of_singles ps rho ((p, x) :: others)) with
      (plusR (value (part_at ps p) x) (sum_of_singles ps rho others)); [exact J|].
    unfold sum_of_singles. simpl. now rewrite <- !plus_assoc, (plus_comm (zeros _)).
Qed.
