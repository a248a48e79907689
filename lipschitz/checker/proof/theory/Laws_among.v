(** An accepted law among a given number of neighbours holds: one term after the other, beside the others where they
    are by then. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Parts Coupled Claims Slopes Witness Laws Ranges Silent.
Import ListNotations.
Open Scope R_scope.

(** Each step beside d, where those before it went, and those after it and t, which have not moved. *)
Fixpoint along (g : list R -> list R) (d : list R) (steps : list moving) (t : list R) : Prop :=
  match steps with
  | [] => True
  | m :: steps' =>
      let s := plusR d (plusR (vector_sum (map before steps')) t) in
      norm (minus (g (plusR (before m) s)) (g (plusR (after m) s))) <= bound m * far m
      /\ along g (plusR d (after m)) steps' t
  end.
Lemma along_app g d a b t : along g d a (plusR (vector_sum (map before b)) t) ->
  along g (plusR d (vector_sum (map after a))) b t -> along g d (a ++ b) t.
Proof.
  revert d. induction a as [|m a IH]; intros d; simpl; [now rewrite plus_nil_r|].
  intros [H G] K. rewrite map_app, vector_sum_app, !plus_assoc in *. split; [exact H|]. apply IH; auto.
  now rewrite plus_assoc.
Qed.
Lemma telescope_along g n steps d t : (forall v, length (g v) = n) -> along g d steps t ->
  norm (minus (g (plusR d (plusR (vector_sum (map before steps)) t)))
    (g (plusR d (plusR (vector_sum (map after steps)) t)))) <= dotR (map bound steps) (map far steps).
Proof.
  intros Hn. revert d. induction steps as [|m steps IH]; intros d; simpl.
  - intros _. unfold norm. rewrite square_minus_same, sqrt_0. lra.
  - intros [H G]. specialize (IH _ G). rewrite !plus_assoc in IH.
    rewrite (minus_through _ (g (plusR d (plusR (after m) (plusR (vector_sum (map before steps)) t))))) by
      now rewrite !Hn.
    rewrite !plus_assoc. eapply Rle_trans; [apply norm_plus|]. apply Rplus_le_compat; [|exact IH].
    rewrite <- !(plus_assoc d), !(plus_comm d), !plus_assoc. exact H.
Qed.

Definition sum_of_inputs (ps : list part) (others : list term) (inputs : list (list (list R))) : list R :=
  vector_sum (flat_map (fun t => map (value (part_at ps (phi (fst t)))) (snd t)) (combine others inputs)).
Lemma sum_of_inputs_app ps a b x y : length a = length x ->
  sum_of_inputs ps (a ++ b) (x ++ y) = plusR (sum_of_inputs ps a x) (sum_of_inputs ps b y).
Proof.
  unfold sum_of_inputs. revert x. induction a as [|t a IH]; intros [|z x] L; try discriminate; auto.
  simpl in L. simpl app. simpl combine. simpl flat_map. rewrite !vector_sum_app, IH by lia. now rewrite plus_assoc.
Qed.
Lemma same_terms_eq a b : same_terms_in_boxes a b = true -> a = b.
Proof.
  revert b. induction a as [|[p b low high] a IH]; intros [|[q c l h] d]; simpl; try discriminate; auto.
  intros H. do 4 both H. apply Nat.eqb_eq in H. apply Z.eqb_eq in H1, H2. apply same_box_eq in H3. subst. f_equal.
  now apply IH.
Qed.
Lemma there_only ps others inputs : Forall2 may_stand others inputs -> exists some,
  Forall2 may_stand (filter may_be_there others) some /\
  sum_of_inputs ps (filter may_be_there others) some = sum_of_inputs ps others inputs.
Proof.
  intros H. induction H as [|t xs others inputs M H (some & S & E)]; [exists []; split; [constructor|reflexivity]|].
  simpl. destruct (may_be_there t) eqn:T.
  - exists (xs :: some). split; [now constructor|]. unfold sum_of_inputs in *. simpl. now rewrite !vector_sum_app, E.
  - exists some. split; auto. rewrite E. unfold may_be_there in T. apply negb_false_iff, Z.eqb_eq in T.
    destruct M as [K _]. destruct xs; [reflexivity|]. simpl length in K. lia.
Qed.
Definition bound_beside (ps : list part) (rho : nat) (before : list (kind * box * Z)) (k : kind * box * Z)
    (after : list (kind * box * Z)) (c : dyadic) : Prop :=
  holds ps (Slope_among (fst (fst (fst (fst k)))) rho (snd (fst (fst (fst k)))) [] (snd (fst k)) (others_of before k
    after) c).
Lemma find_slope_among_sound ps accepted rho before k after u : Forall (holds ps) accepted ->
  let '(p, moves, n, b, least) := k in
  find_slope_among accepted p rho moves b (others_of before k after) = Some u -> bound_beside ps rho before k after u.
Proof.
  destruct k as [[[[p moves] n] b] least]. intros H. induction H as [|c rest Hc H IH]; [discriminate|].
  destruct c as [| | | | | | | | | | |[|] |q j m [|] d ts w| |]; simpl find_slope_among; auto.
  destruct (_ && _)%bool eqn:E; auto. intros G. inversion G. subst w. do 4 both E.
  apply Nat.eqb_eq in E, H3. apply same_moves_eq in H2. apply same_box_eq in H1. apply same_terms_eq in H0. subst.
  intros inputs x y M A L Wx Wy. destruct (there_only ps _ _ M) as (some & S & T).
  pose proof (Hc some x y S A L Wx Wy) as B. cbv zeta in B |- *. fold (sum_of_inputs ps) in B.
  unfold sum_of_inputs in T. rewrite <- T. exact B.
Qed.
Lemma in_box_beside ps rho before k after u :
  holds ps (Slope_in_box (Set_of (fst (fst (fst (fst k)))) rho) (snd (fst (fst (fst k)))) [] (snd (fst k)) u) ->
  bound_beside ps rho before k after u.
Proof. intros H inputs x y _ A L Wx Wy. cbv zeta. now apply H. Qed.
Fixpoint bounds_among ps rho (before : list (kind * box * Z)) (cs : list dyadic) (kinds : list (kind * box * Z)) :
  Prop :=
  match cs, kinds with
  | c :: cs', k :: kinds' => bound_beside ps rho before k kinds' c /\ bounds_among ps rho (before ++ [k]) cs' kinds'
  | [], [] => True
  | _, _ => False
  end.
Definition kind_of (k : kind * box * Z) : kind := fst (fst k).
Lemma total_among_sound ps accepted squares before kinds rho v : Forall (holds ps) accepted ->
  total_among accepted squares before kinds rho = Some v -> exists cs,
  not_negative cs (map kind_of kinds) /\ bounds_among ps rho before cs kinds /\
  real v = fold_right Rplus 0 (map
      (fun ck : dyadic * kind => IZR (snd (snd ck)) * (if squares then
      real (fst ck) * real (fst ck) else real (fst ck))) (combine cs (map kind_of kinds))).
Proof.
  intros HA. revert before v. induction kinds as [|k kinds IH]; intros before v; simpl.
  - intros H. inversion H. exists []. split; [constructor|]. split; [constructor|]. apply real_zero.
  - destruct k as [[[[p moves] n] b] least] eqn:Ek. rewrite <- Ek. set (bound := match find_slope_among _ _ _ _ _ _ with
      Some u => _ | None => _ end). destruct bound as [u|] eqn:Hu; [|discriminate].
    destruct (total_among accepted squares (before ++ [k]) kinds rho) as [w|] eqn:Hw; [|discriminate].
    destruct (is_nonnegative u) eqn:Kn; [|discriminate]. destruct (Z.leb_spec 0 n); [|discriminate]. simpl.
    intros G. inversion G. destruct (IH _ w Hw) as (cs & P & B & E). exists (u :: cs). split; [|split].
    + constructor; auto. subst k. simpl. split; auto. now apply real_nonnegative.
    + split; auto. unfold bound in Hu. pose proof (fun u => find_slope_among_sound ps accepted rho before k kinds u
      HA) as F.
      assert (forall u, find_slope_in accepted p rho moves b = Some u -> bound_beside ps rho before k kinds u) as F'
        by (intros u' G'; apply in_box_beside; subst k; simpl; now apply (find_slope_in_sound ps accepted)).
      subst k. destruct (find_slope_among accepted p rho moves b _) as [a|]; [|now apply F'].
      unfold less_of in Hu. destruct (find_slope_in accepted p rho moves b) as [a'|];
        [destruct (at_most a' a); inversion Hu; subst; auto|inversion Hu; subst; auto].
    + rewrite real_add, real_mul, E. subst k. simpl. f_equal.
      replace (real (n, 0%Z)) with (IZR n) by (unfold real; simpl; ring).
      destruct squares; auto. now rewrite real_mul.
Qed.

(** Terms of the kinds that are not under way, by the inputs at one side. *)
Definition stands (k : kind * box * Z) (xs : list (list R)) : Prop :=
  (snd k <= Z.of_nat (length xs) <= snd (kind_of k))%Z /\ Forall (within (snd (fst k))) xs.
Lemma stands_as_term k xs : stands k xs -> may_stand (term_among 0 k) xs.
Proof. 
  intros [H F]. split; auto. unfold kind_of, term_among in *. cbn [fewest Meaning.most]. destruct (Z.leb_spec 0 (snd
    k - 0)); lia.
Qed.
Lemma stand_as_terms ks xss : Forall2 stands ks xss -> Forall2 may_stand (map (term_among 0) ks) xss.
Proof. intros H. induction H; simpl; constructor; auto using stands_as_term. Qed.
Definition mover_fits ps (k : kind * box * Z) (m : mover) : Prop :=
  agree (snd (fst (kind_of k))) (fst m) (snd m) /\ length (fst m) = inputs_of (part_at ps (fst (fst (kind_of k)))) /\
  within (snd (fst k)) (fst m) /\ within (snd (fst k)) (snd m).
Definition steps_of_kind ps (c : dyadic) (k : kind * box * Z) (ms : list mover) : list moving :=
  let v side m := value (part_at ps (fst (fst (kind_of k)))) (side m) in
  map (fun m => Moving (real c) (v fst m) (v snd m) (step_of m)) ms.
Lemma one_kind ps rho done k after c done_inputs after_inputs ms_done ms : bound_beside ps rho done k after c ->
  Forall2 stands done done_inputs -> Forall2 stands after after_inputs ->
  (snd k <= Z.of_nat (length (ms_done ++ ms)) <= snd (kind_of k))%Z -> Forall (mover_fits ps k) (ms_done ++ ms) ->
  let p := part_at ps (fst (fst (kind_of k))) in
  along (value (part_at ps rho))
    (plusR (sum_of_inputs ps (map (term_among 0) done) done_inputs) (vector_sum (map (fun m => value p (snd m))
      ms_done)))
    (steps_of_kind ps c k ms) (sum_of_inputs ps (map (term_among 0) after) after_inputs).
Proof.
  intros B D A. revert ms_done. induction ms as [|m ms IH]; intros ms_done N F p; simpl; auto. split.
  - set (own := map snd ms_done ++ map fst ms).
    assert (Forall2 may_stand (others_of done k after) (done_inputs ++ own :: after_inputs)) as M.
    { unfold others_of. apply Forall2_app; [now apply stand_as_terms|]. constructor; [|now apply stand_as_terms].
      apply Forall_app in F. destruct F as [F1 F2]. inversion F2; subst. split.
      - assert (length (ms_done ++ m :: ms) = S (length own)) as Lo
          by (unfold own; rewrite !app_length, !map_length; simpl; apply Nat.add_succ_r).
        rewrite Lo, Nat2Z.inj_succ in N. pose proof (Nat2Z.is_nonneg (length own)) as P.
        generalize dependent (Z.of_nat (length own)). intros size N P. clear - N P. destruct k as [[[[q moves] n] b]
          least]. unfold kind_of, term_among in *. cbn [fst snd] in N.
        cbn [fst snd fewest Meaning.most]. destruct (Z.leb_spec 0 (least - 1)); lia.
      - unfold own. simpl. apply Forall_app. split; apply Forall_map; eapply Forall_impl; try eassumption;
          intros m' (_ & _ & W1 & W2); auto. }
    apply Forall_app in F. destruct F as [F1 F2]. inversion F2 as [|? ? (Ag & L & W1 & W2) F2']; subst.
    pose proof (B _ (fst m) (snd m) M Ag L W1 W2) as S. cbv zeta in S. fold (sum_of_inputs ps) in S.
    unfold distance in S. rewrite square_in_one in S. simpl value_of in S.
    assert (sum_of_inputs ps (others_of done k after) (done_inputs ++ own :: after_inputs) =
      plusR (plusR (sum_of_inputs ps (map (term_among 0) done) done_inputs)
        (vector_sum (map (fun m => value p (snd m)) ms_done)))
        (plusR (vector_sum (map before (steps_of_kind ps c k ms)))
          (sum_of_inputs ps (map (term_among 0) after) after_inputs))) as E.
    { unfold others_of. rewrite sum_of_inputs_app by (rewrite map_length; eapply Forall2_lengths; eauto).
      rewrite !plus_assoc. f_equal. unfold sum_of_inputs at 1. simpl. rewrite vector_sum_app. unfold own.
      rewrite map_app, vector_sum_app, !map_map, plus_assoc. unfold steps_of_kind. now rewrite map_map. }
    change (sum_of_inputs ps (others_of done k after) (done_inputs ++ own :: after_inputs)) with
      (vector_sum (flat_map (fun t => map (value (part_at ps (phi (fst t)))) (snd t))
        (combine (others_of done k after) (done_inputs ++ own :: after_inputs)))) in E.
    rewrite E in S. exact S.
  - replace (ms_done ++ m :: ms) with ((ms_done ++ [m]) ++ ms) in * by now rewrite <- app_assoc.
    specialize (IH (ms_done ++ [m]) N F). cbv zeta in IH. rewrite map_app, vector_sum_app in IH. simpl in IH.
    rewrite plus_nil_r, <- plus_assoc in IH. exact IH.
Qed.
Lemma all_kinds ps rho done cs kinds done_inputs movers : bounds_among ps rho done cs kinds ->
  Forall2 stands done done_inputs ->
  Forall2 (fun k ms => (snd k <= Z.of_nat (length ms) <= snd (kind_of k))%Z /\ Forall (mover_fits ps k) ms) kinds
    movers ->
  along (value (part_at ps rho)) (sum_of_inputs ps (map (term_among 0) done) done_inputs)
    (steps_of ps cs (combine (map kind_of kinds) movers)) [].
Proof.
  revert done cs done_inputs movers. induction kinds as [|k kinds IH]; intros done [|c cs] done_inputs movers; simpl;
    try tauto.
  intros [B Bs] D M. inversion M as [|? ms ? movers' [N F] M']; subst. simpl.
  assert (Forall2 stands kinds (map (map fst) movers')) as A.
  { clear - M'. induction M' as [|k ms kinds movers [N F] M' IH]; simpl; constructor; auto. split;
      [now rewrite map_length|]. apply Forall_map. eapply Forall_impl; [|exact F]. intros m (_ & _ & W & _). exact W. }
  assert (stands k (map snd ms)) as K.
  { split; [now rewrite map_length|]. apply Forall_map. eapply Forall_impl; [|exact F]. intros m (_ & _ & _ & W).
    exact W. }
  apply along_app.
  - pose proof (one_kind ps rho done k kinds c done_inputs _ [] ms B D A N F) as G. simpl in G. rewrite plus_nil_r in G.
    rewrite plus_nil_r. replace (vector_sum (map before (steps_of ps cs (combine (map kind_of kinds) movers')))) with
      (sum_of_inputs ps (map (term_among 0) kinds) (map (map fst) movers')); [exact G|].
    clear - Bs M'. unfold sum_of_inputs. f_equal. revert Bs. generalize (done ++ [k]) as d. revert cs.
    induction M' as [|j ms kinds movers _ M' IH]; intros [|c cs] d; simpl; try tauto. intros [_ Bs].
    rewrite map_app, (IH _ _ Bs), !map_map. reflexivity.
  - specialize (IH (done ++ [k]) cs (done_inputs ++ [map snd ms]) movers' Bs). rewrite map_app, sum_of_inputs_app in IH
      by (rewrite map_length; eapply Forall2_lengths; eauto). rewrite map_map. simpl.
    unfold sum_of_inputs at 2 in IH. simpl in IH. rewrite app_nil_r, map_map in IH. apply IH; auto.
    apply Forall2_app; auto.
Qed.
Lemma law_among_sound ps accepted stacked kinds rho u : Forall (holds ps) accepted ->
  check_law_among ps accepted stacked kinds rho u = true -> holds ps (Law_among stacked kinds rho u).
Proof.
  intros HA. unfold check_law_among. intros H. do 2 both H. rename H0 into Ht, H1 into Hf. apply real_nonnegative in H.
  destruct (total_among accepted stacked [] kinds rho) as [v|] eqn:Ev; [|discriminate]. apply at_most_real in Ht.
  destruct (total_among_sound _ _ _ _ _ _ _ HA Ev) as (cs & P & B & E). simpl holds. intros movers M W L.
  apply law_of_steps with (cs := cs) (v := v); auto.
  assert (Forall2 (fun k ms => (snd k <= Z.of_nat (length ms) <= snd (kind_of k))%Z /\ Forall (mover_fits ps k) ms)
    kinds
    movers) as F.
  { clear - M W L. induction W as [|k ms kinds movers [N W] Ws IH]; simpl in *; constructor;
      inversion M as [|? ? ? ? [C A] M']; inversion L as [|? ? Lk L']; subst; auto.
    destruct k as [[[[q moves] n] b] least]. simpl in *. split; [exact (conj N C)|].
    rewrite Forall_forall in *. intros m I. destruct (W m I). unfold mover_fits. simpl. auto. }
  pose proof (all_kinds ps rho [] cs kinds [] movers B (Forall2_nil _) F) as T.
  apply telescope_along with (n := length (fst (outer (part_at ps rho)))) in T; [|intros; now apply length_value].
  rewrite !plus_nil_r in T. exact T.
Qed.
